#pragma once

#include <filesystem>
#include <memory>

#include "esim/recording/format.h"

namespace esim::inline formats::aedat4 {

std::unique_ptr<Source> open_reader(const std::filesystem::path& path, const ReadOptions& options);

}  // namespace esim::inline formats::aedat4
