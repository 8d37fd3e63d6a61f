#include <gtest/gtest.h>

#include <cstdlib>

#include "esim/formats/hdf5/dsec.h"
#include "esim/formats/hdf5/truth.h"
#include "formats/recordings.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

constexpr const char* kScript = R"py(
import sys
import h5py, numpy as np

with h5py.File(sys.argv[1] + "/events.h5") as f:
    t, x, y, p = (f["events"][k][:] for k in "txyp")
    assert [a.dtype.name for a in (t, x, y, p)] == ["uint32", "uint16", "uint16", "uint8"]
    assert f["ms_to_idx"].dtype == np.uint64 and f["t_offset"].dtype == np.int64 and f["t_offset"].shape == ()
    assert f["t_offset"][()] == 1500000
    assert f.attrs["width"] == 64 and f.attrs["height"] == 48 and f.attrs["esim_complete"] == 1
    unit = f.attrs["unit"]
    assert (unit.decode() if isinstance(unit, bytes) else unit) == "us"
    reference = np.loadtxt(sys.argv[1] + "/events.csv", delimiter=",", dtype=np.int64)
    assert (t == reference[:, 0] // 1000 - 1500000).all()
    assert (x == reference[:, 1]).all() and (y == reference[:, 2]).all()
    assert (p == (reference[:, 3] > 0)).all()
    assert (f["ms_to_idx"][:] == np.searchsorted(t, 1000 * np.arange(201))).all()

with h5py.File(sys.argv[1] + "/truth.h5") as f:
    assert f["depth"].shape == (2, 48, 64) and f["depth"].dtype == np.float32
    assert f["motion_field"].shape == (2, 2, 48, 64)
    assert np.isinf(f["depth"][0, 0, 0]) and abs(f["motion_field"][1, 1, 0, 0] + 15) < 1e-3
    assert f["T_world_camera"].shape == (2, 7) and (f["T_world_camera"][0] == [0, 0, 0, 0, 0, 0, 1]).all()
    assert f["t"][:].tolist() == [1500000000, 1600000000]
    assert "convention" in f["motion_field"].attrs
)py";

TEST(Interop, H5py) {
  if (std::system("/usr/bin/python3 -c 'import h5py' 2>/dev/null") != 0) GTEST_SKIP() << "no h5py in /usr/bin/python3";
  const test::TemporaryDirectory directory;
  const TimeNs start = 1'500'000'000, end = start + 200'000'000;
  const auto info = test::recording_info(64, 48, start, end);
  const auto events = test::random_events(100'000, 64, 48, start, end);
  EventsHdf5Writer writer(directory.path() / "events.h5", 0);
  test::record(writer, info, events);
  std::string csv;
  for (const Event& event : events) {
    csv += std::to_string(event.t) + "," + std::to_string(event.x) + "," + std::to_string(event.y) + "," +
           std::to_string(event.polarity) + "\n";
  }
  directory.write("events.csv", csv);

  TruthHdf5Writer truth(directory.path() / "truth.h5", 0);
  truth.begin(info);
  for (const TimeNs t : {start, start + 100'000'000}) truth.write(test::TruthImages(64, 48, 0).at(t));
  truth.end(true);

  const auto script = directory.write("check.py", kScript);
  EXPECT_EQ(std::system(("/usr/bin/python3 " + script.string() + " " + directory.path().string()).c_str()), 0);
}

}  // namespace
}  // namespace esim
