#pragma once

#include <filesystem>
#include <memory>
#include <string_view>

#include "esim/record/format.h"

namespace esim {

/// Names of datasets of an HDF5 file, one number for each event. Times that are floating-point numbers are in s,
/// integers in us. ON is a polarity above 0.
struct EventColumns {
  const char *t, *x, *y, *p;
  const char* resolution = nullptr;  ///< width and height, px
  const char* ms_index = nullptr;    ///< one entry for each ms since the start of the recording, at 0
};

/// Is it an HDF5 file with all four of them?
bool has_event_columns(const EventColumns& names, const std::filesystem::path& path, std::string_view head);

std::unique_ptr<Source> open_event_columns(const EventColumns& names, const std::filesystem::path& path,
                                           const ReadOptions& options);

bool is_hdf5(std::string_view head);

/// `x, y, p, t` at the top, as e2calib takes them: only read.
Format e2calib_format();

/// `events/xs, ys, ps, ts`, as the tools around E2VID take them: only read.
Format e2vid_format();

}  // namespace esim
