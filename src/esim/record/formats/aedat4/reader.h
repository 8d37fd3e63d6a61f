#pragma once

#include <filesystem>
#include <memory>

#include "esim/record/format.h"

namespace esim::aedat4 {

std::unique_ptr<Source> open_reader(const std::filesystem::path& path, const ReadOptions& options);

}  // namespace esim::aedat4
