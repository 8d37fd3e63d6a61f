#pragma once

#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "esim/record/format.h"
#include "esim/record/preview/scales.h"
#include "esim/visualise/page.h"

namespace esim {

/// What of a recording is shown.
struct Extent {
  int camera = 0;
  double start_s = 0;                  ///< since the start of the recording
  std::optional<double> duration_s{};  ///< all that follows, without
};

/// What is known of a recording, and of one camera's part in it, once it has been read.
struct Survey {
  SensorSize sensor{};               ///< where it is not known: as far as the events reach
  TimeNs origin = 0;                 ///< start of the recording
  TimeNs start = 0, end = 0;         ///< of what is shown; within the recording
  std::uint64_t events = 0;          ///< from start to end
  std::map<Content, TimeNs> last{};  ///< kinds of record that can be shown, and the time of the last one read
  DepthScale depth{};                ///< suits all depths that are shown
  FlowScale motion{};
};

/// What the records can fill, in the order of View: depth and motion need ground truth, the image a frame of any kind.
std::vector<View> views_of(const Survey& survey);

/// Reads a recording up to the end of what is to be shown. `proceed` is told the share (0 to 1) that is done, and says
/// whether to go on; where it does not, nothing comes of it.
std::optional<Survey> survey(Source& source, const Extent& extent, const std::function<bool(double)>& proceed);

/// Of which camera a record is, and when; nothing for those that are not of a camera or not shown.
struct RecordStamp {
  int camera = 0;
  TimeNs first = 0, last = 0;
};
std::optional<RecordStamp> stamp_of(const Record& record);

}  // namespace esim
