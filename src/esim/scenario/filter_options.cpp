#include "esim/scenario/filter_options.h"

#include "esim/scenario/yaml/yaml_reader.h"

namespace esim::inline scenario {

FilterOptions read_filters(const std::vector<std::string>& overrides, const std::string& setter) {
  FilterOptions options = read_overrides<FilterOptions>(overrides, setter);
  refuse(find_problem(options));
  return options;
}

}  // namespace esim::inline scenario
