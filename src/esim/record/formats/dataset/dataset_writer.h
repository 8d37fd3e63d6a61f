#pragma once

#include <functional>
#include <memory>

#include "esim/record/formats/dataset/files_output.h"
#include "esim/record/record.h"

namespace esim {

/// Writes what camera 0 sees. Of the calibration, what calib.txt cannot hold is left out with the file: other
/// distortions than the radial-tangential one. `open` is called when the recording begins.
std::unique_ptr<Sink> make_dataset_writer(std::function<std::unique_ptr<FilesOutput>()> open);

}  // namespace esim
