#pragma once

#include <hdf5.h>

#include <vector>

// Private to record/formats: includes hdf5.h.

namespace esim::hdf5 {

struct DriverFile;

/// A write that waits for the end of a flush.
struct HeldWrite {
  H5FD_mem_t type;
  haddr_t address;
  std::vector<char> bytes;
};

/// What became of one file's writes.
struct OutputState {
  int error = 0;         ///< errno of the first failure; 0: none
  bool durable = false;  ///< closing waits for the disk

  // For the driver.
  DriverFile* file = nullptr;
  bool holding = false;
  std::vector<HeldWrite> held{};
};

/// Makes files opened with this access list go through esim's own file driver. The library does not survive failing
/// writes well: its caches try again at every close, up to the end of the program. So this driver notes the first
/// failure in `state`, which must outlive the file, and from then on pretends that writing succeeds; its owner looks
/// at `state` and gives up. The bytes in the file are those of the default driver.
herr_t set_output_driver(hid_t access_list, OutputState& state);

/// H5Fflush(), so ordered that a process that is killed at any moment, or a full disk, leaves a file that can be read:
/// first what is new is written, which nothing refers to yet; then the indices that refer to it; then how long the
/// datasets are. Where there is no room for what is new, the file stays as the last flush has left it.
herr_t flush_in_order(hid_t file, OutputState& state);

}  // namespace esim::hdf5
