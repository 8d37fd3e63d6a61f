#pragma once

#include <filesystem>
#include <memory>
#include <string_view>

#include "esim/recording/format.h"

namespace esim::inline formats {

/// Names of HDF5 datasets with one number per event. Times that are floating-point numbers are in s, integers in us. A
/// polarity above 0 is ON.
struct EventColumns {
  const char *t, *x, *y, *p;
  const char* resolution = nullptr;  ///< width and height, px
  const char* ms_index = nullptr;    ///< one entry per ms since the start of the recording, which is 0
};

/// Whether a file is HDF5 and has all four of them.
bool has_event_columns(const EventColumns& names, const std::filesystem::path& path, std::string_view head);

std::unique_ptr<Source> open_event_columns(const EventColumns& names, const std::filesystem::path& path,
                                           const ReadOptions& options);

bool is_hdf5(std::string_view head);

/// `x, y, p, t` at the top, the input of e2calib: read only.
Format e2calib_format();

/// `events/xs, ys, ps, ts`, used by the tools around E2VID: read only.
Format e2vid_format();

}  // namespace esim::inline formats
