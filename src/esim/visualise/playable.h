#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "esim/formats/formats.h"
#include "esim/visualise/page.h"

namespace esim::inline visualise {

/// A recording or event file that can be opened repeatedly: for its overview, and to show it. For a folder that has no
/// known format, the event file in it.
class Playable {
 public:
  /// `sensor` replaces the size in the file. Throws UserError if there is nothing to read.
  Playable(const std::filesystem::path& path, std::optional<SensorSize> sensor);

  std::unique_ptr<Source> open() const { return open_source(path_, reading_); }

  /// The index of the camera with this name, or of the only camera. Throws UserError if there is no such camera.
  int camera(const std::string& name) const;

  /// Name of the file or folder, for headlines.
  const std::string& name() const { return name_; }

 private:
  std::filesystem::path path_;
  std::string name_;
  ReadOptions reading_;
};

/// The views with these names, without duplicates; empty for "all". Throws UserError for unknown names.
std::vector<View> views_named(const std::vector<std::string>& names);

}  // namespace esim::inline visualise
