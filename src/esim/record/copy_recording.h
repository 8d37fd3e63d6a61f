#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "esim/core/remedy.h"
#include "esim/record/format.h"

namespace esim {

struct CopyOptions {
  std::string camera{};    ///< only this one, by its name; empty: all, or the only one
  bool from_zero = false;  ///< times count from the start of the recording
  WriteOptions write{};
};

/// What was copied, and what the target's format could not hold.
struct CopySummary {
  std::map<Content, std::uint64_t> copied{}, left_out{};  ///< events, frames, ...: how many
  std::vector<std::string> not_read{};                    ///< what of the input cannot be read, for people
  TimeNs rounded_to = 0;  ///< ns; times of events were rounded down to multiples of it; 0: they were not
  bool complete = true;   ///< else it was stopped
};

/// Copies a recording, record by record, to a path in a format that is written. `go_on` is asked after each, with the
/// fraction that has been read. Throws UserError if the format holds one camera and none of several has been chosen, or
/// if there is no camera of that name; what cannot be read or written throws too, when all that came before has been
/// handed on; the target has ended incomplete then, but for one that cannot be written.
CopySummary copy_recording(Source& from, const Format& format, const std::filesystem::path& to,
                           const CopyOptions& options, const std::function<bool(double)>& go_on);

struct ConvertOptions {
  CopyOptions copy{};
  ReadOptions read{};
  bool replace = false;  ///< what is there already
};

/// Opens what is at `from`, and makes the file or the folder `to` of it, which is there only when it is whole; see
/// copy_recording(). What has been recovered from a damaged file is not `complete`. Throws UserError for a format that
/// is only read, for a `to` that is there and not to be replaced, where `from` has no camera and the format holds
/// nothing else, and where all that `from` holds is of unknown kinds. If something cannot be written, the OutputError
/// says where what was written before it is kept: as `to`.incomplete.
CopySummary convert_recording(const std::filesystem::path& from, const Format& format, const std::filesystem::path& to,
                              const ConvertOptions& options, const std::function<bool(double)>& go_on);

/// Something that was left out or changed: a line for people, and how to keep it.
struct Loss {
  std::string what{};
  Remedy remedy = Remedy::none;

  bool operator==(const Loss&) const = default;
};

std::vector<Loss> losses(const CopySummary& summary, const Format& format);

}  // namespace esim
