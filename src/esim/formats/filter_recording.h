#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "esim/filters/filter_chain.h"
#include "esim/formats/copy_recording.h"

namespace esim::inline formats {

/// The number of events of one camera before the filters, and how many of them each filter has dropped, in the order in
/// which events pass the filters.
struct FilteredCamera {
  std::string name{};
  std::uint64_t events = 0;
  std::vector<FilterChain::Dropped> dropped{};

  std::uint64_t kept() const;
};

/// As a table for users: one line per filter and camera.
std::string describe(const std::vector<FilteredCamera>& cameras);

/// [{"name": "cam0", "events": 100, "dropped": {"trail": 20}, "kept": 80}, ...]
std::string to_json(const std::vector<FilteredCamera>& cameras);

struct FilterSummary {
  CopySummary copy{};                     ///< copied events: those that passed
  std::vector<FilteredCamera> cameras{};  ///< those that have been copied
};

/// Copies a recording as convert_recording() does, with the events of each camera filtered by a FilterChain. Everything
/// else is copied unchanged, except points of events, which are left out. The report.json of a folder has the options
/// of the filters and the numbers of events. Throws UserError also for invalid options of the filters, and a
/// RemediableError (sensor_size) if a camera has events but no known size.
FilterSummary filter_recording(const std::filesystem::path& from, const Format& format, const std::filesystem::path& to,
                               const FilterOptions& filters, const ConvertOptions& options,
                               const std::function<bool(double)>& go_on);

/// A source with the events of `inner` that pass the filters; events of cameras other than `camera`, if that is not
/// empty, are unchanged. `cameras` is kept up to date and must outlive the source.
std::unique_ptr<Source> filtered(std::unique_ptr<Source> inner, const FilterOptions& filters, const std::string& camera,
                                 std::vector<FilteredCamera>& cameras);

}  // namespace esim::inline formats
