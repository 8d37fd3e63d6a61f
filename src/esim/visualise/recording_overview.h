#pragma once

#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "esim/preview/scales.h"
#include "esim/recording/format.h"
#include "esim/visualise/page.h"

namespace esim::inline visualise {

/// The part of a recording to show.
struct Extent {
  int camera = 0;
  double start_s = 0;                  ///< since the start of the recording
  std::optional<double> duration_s{};  ///< if not set, up to the end
};

/// Properties of a recording and of one of its cameras, found by reading it.
struct RecordingOverview {
  SensorSize sensor{};               ///< if unknown: large enough for the events
  TimeNs origin = 0;                 ///< start of the recording
  TimeNs start = 0, end = 0;         ///< of the part to show, within the recording
  std::uint64_t events = 0;          ///< from start to end
  std::map<Content, TimeNs> last{};  ///< kinds of records that can be shown, with the time of the last one
  DepthScale depth{};                ///< scale for all depths that are shown
  MotionScale motion{};
};

/// The views that the records support, in the order of View: depth and motion need ground truth, image any frame.
std::vector<View> views_of(const RecordingOverview& overview);

/// Reads a recording up to the end of the part to show. `proceed` receives the completed fraction (0 to 1) and returns
/// whether to continue; if it returns false, the result is empty.
std::optional<RecordingOverview> read_overview(Source& source, const Extent& extent,
                                               const std::function<bool(double)>& proceed);

/// Camera and time of a record; nothing for records without a camera and for those that are not shown.
struct RecordStamp {
  int camera = 0;
  TimeNs first = 0, last = 0;
};
std::optional<RecordStamp> stamp_of(const Record& record);

}  // namespace esim::inline visualise
