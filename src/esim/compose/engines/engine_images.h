#pragma once

#include <optional>
#include <string>
#include <vector>

#include "esim/backends/unrealcv/unrealcv_renderer.h"
#include "esim/compose/compose.h"
#include "esim/core/inputs/used_files.h"

// Private to compose.
namespace esim::inline compose {

/// Identifies the images of a program for a cache: this esim, the options that determine images, what the program says
/// of itself, and what else is given. Connects to the program.
std::string identity_of_images(const UnrealcvOptions& options, UnrealcvClient& client,
                               const std::vector<std::string>& others);

/// Identifies the contents of files; folders by the names, sizes and times of their files. Warns and returns nothing if
/// a file has changed since.
std::optional<std::vector<std::string>> identities_of(const std::vector<UsedFile>& files, const NoticeHandler& warning);

}  // namespace esim::inline compose
