#pragma once

#include <hdf5.h>

// Private to record/formats: includes hdf5.h.

namespace esim::hdf5 {

/// What became of one file's writes.
struct OutputState {
  int error = 0;         ///< errno of the first failure; 0: none
  bool durable = false;  ///< closing waits for the disk
};

/// Makes files opened with this access list go through esim's own file driver. The library does not survive failing
/// writes well: its caches try again at every close, up to the end of the program. So this driver notes the first
/// failure in `state`, which must outlive the file, and from then on pretends that writing succeeds; its owner looks
/// at `state` and gives up. The bytes in the file are those of the default driver.
herr_t set_output_driver(hid_t access_list, OutputState& state);

}  // namespace esim::hdf5
