#pragma once

#include <filesystem>
#include <memory>
#include <string_view>
#include <vector>

#include "esim/recording/format.h"

namespace esim::inline formats {

/// All formats.
const std::vector<Format>& all_formats();

/// The format of this name. Throws UserError, with the known names, for unknown names.
const Format& format_named(std::string_view name);

/// The format of an existing file or folder. Throws UserError if the path does not exist or its content is unknown.
const Format& format_of(const std::filesystem::path& path);

/// The format of a folder with events of another program; null for other folders.
const Format* find_format_of_others(const std::filesystem::path& folder);

/// The format for writing to a path, by its extension. For unknown extensions, this returns null and format_for()
/// throws UserError.
const Format* find_format_for(const std::filesystem::path& path);
const Format& format_for(const std::filesystem::path& path);

/// Opens a file of any format, checked by CheckedSource: events that are out of order or outside the sensor, as far as
/// its size is known, are a UserError with index and values.
std::unique_ptr<Source> open_source(const std::filesystem::path& path, const ReadOptions& options = {});

/// Throws UserError, with the unsupported contents of the file, if a recording from `path` has no camera.
void require_camera(const Source& source, const std::filesystem::path& path);

}  // namespace esim::inline formats
