#pragma once

#include <functional>
#include <memory>

#include "esim/formats/datasets/files_output.h"
#include "esim/recording/record.h"

namespace esim::inline formats {

/// Writes the records of camera 0. calib.txt is omitted if it cannot hold the distortion, which must be
/// radial-tangential. Calls `open` when the recording begins.
std::unique_ptr<Sink> make_dataset_writer(std::function<std::unique_ptr<FilesOutput>()> open);

}  // namespace esim::inline formats
