#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "esim/formats/formats.h"

namespace esim::test {

/// Names of all formats that hold events and can be written and read.
inline std::vector<std::string> event_formats(bool folders) {
  std::vector<std::string> names;
  for (const Format& format : all_formats()) {
    if (format.can_hold(Content::events) && format.create && format.open && (folders || !format.folder))
      names.push_back(format.name);
  }
  return names;
}

/// A name without the characters that test names cannot have.
inline std::string name_of_test(const testing::TestParamInfo<std::string>& test) {
  std::string name = test.param;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

}  // namespace esim::test
