#pragma once

#include <cstdlib>
#include <filesystem>
#include <optional>

namespace esim::test {

/// A file below the directory that the environment variable ESIM_TEST_DATA names; nothing where it is unset or there is
/// no such file.
inline std::optional<std::filesystem::path> test_data(const std::filesystem::path& name) {
  const char* directory = std::getenv("ESIM_TEST_DATA");
  if (directory == nullptr || *directory == '\0') return std::nullopt;
  const std::filesystem::path file = std::filesystem::path(directory) / name;
  if (!std::filesystem::exists(file)) return std::nullopt;
  return file;
}

}  // namespace esim::test
