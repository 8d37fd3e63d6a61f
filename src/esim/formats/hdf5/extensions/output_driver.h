#pragma once

#include <hdf5.h>

#include <vector>

// Private to formats: includes hdf5.h.
namespace esim::inline formats::hdf5 {

struct DriverFile;

/// A write that is postponed to the end of a flush.
struct HeldWrite {
  H5FD_mem_t type;
  haddr_t address;
  std::vector<char> bytes;
};

/// The state of the writes to one file.
struct OutputState {
  int error = 0;         ///< errno of the first failure; 0: no failure
  bool durable = false;  ///< closing waits for the disk

  // Used by the driver only.
  DriverFile* file = nullptr;
  bool holding = false;
  std::vector<HeldWrite> held{};
};

/// Makes files opened with this access list use esim's own file driver. The library does not handle failing writes
/// well: its caches try again at every close, up to the end of the program. So this driver notes the first failure in
/// `state`, which must outlive the file, and from then on pretends that writes succeed; its owner checks `state` and
/// gives up. The bytes in the file are those of the default driver.
herr_t set_output_driver(hid_t access_list, OutputState& state);

/// H5Fflush() in an order that leaves a readable file if the process is killed at any moment or the disk is full: first
/// the new data, to which nothing refers yet; then the indices that refer to them; then the lengths of the datasets. If
/// there is no room for the new data, the file stays in the state of the last flush.
herr_t flush_in_order(hid_t file, OutputState& state);

}  // namespace esim::inline formats::hdf5
