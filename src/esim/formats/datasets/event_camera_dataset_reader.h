#pragma once

#include <memory>

#include "esim/formats/datasets/files_input.h"
#include "esim/recording/format.h"

namespace esim::inline formats {

/// Throws UserError if there is no events.txt. Records of all kinds come roughly in order of time.
std::unique_ptr<Source> open_dataset(std::unique_ptr<FilesInput> files, const ReadOptions& options);

}  // namespace esim::inline formats
