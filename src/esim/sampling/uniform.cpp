#include "esim/sampling/criterion.h"

namespace esim {

double wanted_interval_s(const UniformSampling& options, const SensorTraits&, const Sample&, const Workers&) {
  return 1.0 / options.rate_hz;
}

}  // namespace esim
