#pragma once

#include <optional>

#include "esim/core/image.h"
#include "esim/formats/ros/messages/messages.h"
#include "esim/geometry/camera.h"

namespace esim::inline formats::ros {

/// Writes intrinsics into CameraInfo: "plumb_bob", "equidistant" or "fov". The header stays unchanged.
CameraInfoMessage to_message(const Camera& camera);

/// Reads intrinsics; without them if the message has none or an unsupported distortion.
Camera to_camera(const CameraInfoMessage& message);

/// Digital numbers as mono8, or as mono16 if they have more than 8 bits; the bytes are stored in `buffer`.
ImageMessage to_message(const Image<std::uint16_t>& numbers, int bits, std::vector<std::uint8_t>& buffer);

/// mono8; borrows the image.
ImageMessage to_message(const Image<std::uint8_t>& image);

/// 32FC1; borrows the image.
ImageMessage to_message(const Image<float>& image);

/// Borrows the images.
FlowMessage to_message(const Image<float>& flow_x, const Image<float>& flow_y);

/// Reads a frame: grey and mosaics unchanged, colour as luma. Returns its bits, 8 or 16, or 0, without a frame, if the
/// encoding does not have numbers of 8 or 16 bits. Throws Malformed if the sizes do not match.
int to_frame(const ImageMessage& message, Image<std::uint16_t>& frame);

/// Reads 32FC1 unchanged and 16UC1 as millimetres (REP 118); returns false for other encodings. Throws Malformed if the
/// sizes do not match.
bool to_floats(const ImageMessage& message, Image<float>& image);

/// Throws Malformed if the sizes do not match.
void to_images(const FlowMessage& message, Image<float>& flow_x, Image<float>& flow_y);

/// The pose, with a rotation of unit norm. Throws Malformed if it is invalid.
SE3 checked_pose(SE3 pose);

}  // namespace esim::inline formats::ros
