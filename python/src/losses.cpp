#include "losses.h"

#include <fmt/format.h>

#include "esim/record/number_text.h"

namespace esim::python {

std::vector<std::string> losses(const Summary& summary) {
  std::vector<std::string> lines;
  for (const CameraSummary& camera : summary.cameras) {
    const std::int64_t dropped = camera.sensor.dropped;
    if (dropped == 0) continue;
    const std::int64_t all = dropped + camera.events_on + camera.events_off;
    lines.push_back(
        fmt::format("{}: the readout dropped {} events, {:.3g} % of all, because its queue was full; raise "
                    "event_camera.readout.queue_events or event_camera.readout.rate_mev_per_s, or lower "
                    "event_camera.readout.row_time_us",
                    camera.name, grouped(static_cast<std::uint64_t>(dropped)),
                    100.0 * static_cast<double>(dropped) / static_cast<double>(all)));
  }
  return lines;
}

}  // namespace esim::python
