#pragma once

#include <optional>

#include "esim/core/image.h"
#include "esim/geometry/camera.h"
#include "esim/record/formats/ros/messages.h"

namespace esim::ros {

/// Intrinsics as CameraInfo: "plumb_bob", "equidistant" or "fov". The header is left as it is.
CameraInfoMessage to_message(const Camera& camera);

/// Without intrinsics where the message has none, or a distortion that is none of esim's.
Camera to_camera(const CameraInfoMessage& message);

/// Digital numbers as mono8, or mono16 where they have more than 8 bits; the bytes go to `buffer`.
ImageMessage to_message(const Image<std::uint16_t>& numbers, int bits, std::vector<std::uint8_t>& buffer);

/// mono8; borrows the image.
ImageMessage to_message(const Image<std::uint8_t>& image);

/// 32FC1; borrows the image.
ImageMessage to_message(const Image<float>& image);

/// Borrows the images.
FlowMessage to_message(const Image<float>& flow_x, const Image<float>& flow_y);

/// A frame: grey and mosaics as they are, colours as their luma. 8 or 16: its bits; 0, and no frame, for encodings that
/// are none of numbers of 8 or 16 bits. Throws Malformed where the sizes do not fit.
int to_frame(const ImageMessage& message, Image<std::uint16_t>& frame);

/// 32FC1 as it is, 16UC1 as millimetres (REP 118); false for other encodings. Throws Malformed likewise.
bool to_floats(const ImageMessage& message, Image<float>& image);

/// Throws Malformed where the sizes do not fit.
void to_images(const FlowMessage& message, Image<float>& flow_x, Image<float>& flow_y);

/// With a rotation of unit norm. Throws Malformed for what is no pose.
SE3 checked_pose(SE3 pose);

}  // namespace esim::ros
