#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "esim/core/remedy.h"
#include "esim/recording/format.h"

namespace esim::inline formats {

struct CopyOptions {
  std::string camera{};    ///< name of the camera to copy; empty: all, or the only one
  bool from_zero = false;  ///< make times relative to the start of the recording
  WriteOptions write{};
};

/// What was copied, and what the target format could not hold.
struct CopySummary {
  std::map<Content, std::uint64_t> copied{}, left_out{};  ///< number of events, frames, ...
  std::vector<std::string> not_read{};                    ///< unsupported parts of the input, as text
  TimeNs rounded_to = 0;  ///< ns; event times were rounded down to multiples of it; 0: they were not
  bool complete = true;   ///< false: it was stopped
};

/// Copies a recording, record by record, to `to` in a format that can be written. Calls `go_on` after each record with
/// the fraction that has been read. Throws UserError if the format holds one camera and none of several has been
/// chosen, or if no camera has that name. If reading or writing fails, throws after all earlier records have been
/// passed on; the target has then been ended as incomplete, except after a failure to write.
CopySummary copy_recording(Source& from, const Format& format, const std::filesystem::path& to,
                           const CopyOptions& options, const std::function<bool(double)>& go_on);

struct ConvertOptions {
  CopyOptions copy{};
  ReadOptions read{};
  bool replace = false;  ///< replace existing output

  /// If set, makes the source that is copied of the input, to change its records.
  std::function<std::unique_ptr<Source>(std::unique_ptr<Source> input)> change{};

  /// If set, called at the end if the output is a folder: further entries of its report.json, as JSON by their names.
  std::function<std::map<std::string, std::string>()> report{};
};

/// Converts `from` to the file or folder `to`, which appears only when it is complete; see copy_recording(). What is
/// recovered from a damaged file is not `complete`. Throws UserError if the format cannot be written, if `to` exists
/// and must not be replaced, if `from` has no camera but the format needs one, and if all contents of `from` are
/// unsupported. If writing fails, the OutputError says where the data written so far are kept: in `to`.incomplete.
CopySummary convert_recording(const std::filesystem::path& from, const Format& format, const std::filesystem::path& to,
                              const ConvertOptions& options, const std::function<bool(double)>& go_on);

/// Something that was left out or changed, as a line of text, and how to keep it.
struct Loss {
  std::string what{};
  Remedy remedy = Remedy::none;

  bool operator==(const Loss&) const = default;
};

std::vector<Loss> losses(const CopySummary& summary, const Format& format);

}  // namespace esim::inline formats
