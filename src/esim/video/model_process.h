#pragma once

#include <filesystem>
#include <memory>

#include "esim/video/frame_interpolator.h"

namespace esim::inline video {

/// A learned interpolator in a file of ONNX for frames of a size, with three planes if `colour`. ONNX Runtime runs it
/// in a process of its own, through the Python package of esim (python/esim/interpolators/__main__.py): the program
/// `python3`, or the one that the environment variable ESIM_PYTHON names. Throws UserError if the file, Python, its
/// packages or the inputs of the model are not suitable. The process ends with this object.
std::unique_ptr<FrameInterpolator> start_model_process(const std::filesystem::path& model, int width, int height,
                                                       bool colour);

}  // namespace esim::inline video
