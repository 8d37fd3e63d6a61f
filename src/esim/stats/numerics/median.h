#pragma once

#include <vector>

namespace esim::inline stats {

/// The median; of an even number of values, the mean of the two in the middle; 0 if `values` is empty.
double median(std::vector<double> values);

}  // namespace esim::inline stats
