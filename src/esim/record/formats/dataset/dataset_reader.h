#pragma once

#include <memory>

#include "esim/record/format.h"
#include "esim/record/formats/dataset/files_input.h"

namespace esim {

/// Throws UserError if there is no events.txt. Records of all kinds come roughly in order of time.
std::unique_ptr<Source> open_dataset(std::unique_ptr<FilesInput> files, const ReadOptions& options);

}  // namespace esim
