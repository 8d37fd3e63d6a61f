#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "esim/record/format.h"
#include "esim/visualise/page.h"

namespace esim {

/// A recording or file of events that can be opened again and again: to survey it, and to show it. Of a folder that is
/// of no format, the events in it.
class Playable {
 public:
  /// `sensor` replaces what the file says. Throws UserError where there is nothing that is read.
  Playable(const std::filesystem::path& path, std::optional<SensorSize> sensor);

  std::unique_ptr<Source> open() const { return open_source(path_, reading_); }

  /// The index of the camera of that name, or of the only one. Throws UserError where there is none.
  int camera(const std::string& name) const;

  /// Of the file or folder, for headlines.
  const std::string& name() const { return name_; }

 private:
  std::filesystem::path path_;
  std::string name_;
  ReadOptions reading_;
};

/// The views of these names, once each; of "all", none. Throws UserError for others.
std::vector<View> views_named(const std::vector<std::string>& names);

}  // namespace esim
