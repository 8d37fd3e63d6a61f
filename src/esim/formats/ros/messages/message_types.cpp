#include "esim/formats/ros/messages/message_types.h"

#include <array>
#include <span>
#include <vector>

namespace esim::inline formats::ros {
namespace {

struct Definition {
  std::string_view name;
  std::string_view text;
  std::vector<std::string_view> parts{};  // the types that it contains, recursively, in order of appearance
  std::string_view ros2_text{};           // if it differs
};

struct Known {
  MessageType type;
  std::string_view name;
  std::string_view md5;
};

constexpr std::array kKnown = {
    Known{MessageType::events, "dvs_msgs/EventArray", "5e8beee5a6c107e504c2e78903c224b8"},
    Known{MessageType::image, "sensor_msgs/Image", "060021388200f6f0f447d0fcd9c64743"},
    Known{MessageType::camera_info, "sensor_msgs/CameraInfo", "c9a58c1b0b154e0e6da7578cb991d214"},
    Known{MessageType::imu, "sensor_msgs/Imu", "6a62c6daae103f4ff57a132d6f95cec2"},
    Known{MessageType::pose, "geometry_msgs/PoseStamped", "d3812c3cbc69362b77dc0b19b345f8f5"},
    Known{MessageType::twist, "geometry_msgs/TwistStamped", "98d34b0043a2093cf9d9345ab6eef12e"},
    Known{MessageType::accel, "geometry_msgs/AccelStamped", "d8a98a5d81351b6eb0578c78557e7659"},
    Known{MessageType::transforms, "tf2_msgs/TFMessage", "94810edda583a504dfda3829e70d7eec"},
    Known{MessageType::flow, "esim_msgs/OpticFlow", "1d447e443e01be233472e6f68c671fd7"},
    Known{MessageType::frame_info, "esim_msgs/FrameInfo", "ae9f8dcd7e0bf684080d955778c3ad6f"},
    Known{MessageType::event_packet, "event_camera_msgs/EventPacket", "8a6101b351a64529ac77bd8b71074e52"},
    Known{MessageType::clock, "rosgraph_msgs/Clock", "a9c97c1d230cfc112e270351a944ee47"},
    Known{MessageType::odometry, "nav_msgs/Odometry", "cd5e73d190d741a2f92e81eda573aca7"},
    // Other names for the same fields.
    Known{MessageType::events, "prophesee_event_msgs/EventArray", ""},
    Known{MessageType::transforms, "tf/tfMessage", ""},
};

const std::vector<Definition>& definitions() {
  static const std::vector<Definition> all = {
      {"dvs_msgs/EventArray",
       "std_msgs/Header header\nuint32 height\nuint32 width\ndvs_msgs/Event[] events\n",
       {"std_msgs/Header", "dvs_msgs/Event"}},
      {"sensor_msgs/Image",
       "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\n"
       "uint8[] data\n",
       {"std_msgs/Header"}},
      {"sensor_msgs/CameraInfo",
       "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] D\nfloat64[9] K\n"
       "float64[9] R\nfloat64[12] P\nuint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi\n",
       {"std_msgs/Header", "sensor_msgs/RegionOfInterest"},
       "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\nfloat64[9] k\n"
       "float64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi\n"},
      {"sensor_msgs/Imu",
       "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
       "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
       "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n",
       {"std_msgs/Header", "geometry_msgs/Quaternion", "geometry_msgs/Vector3"}},
      {"geometry_msgs/PoseStamped",
       "std_msgs/Header header\ngeometry_msgs/Pose pose\n",
       {"std_msgs/Header", "geometry_msgs/Pose", "geometry_msgs/Point", "geometry_msgs/Quaternion"}},
      {"geometry_msgs/TwistStamped",
       "std_msgs/Header header\ngeometry_msgs/Twist twist\n",
       {"std_msgs/Header", "geometry_msgs/Twist", "geometry_msgs/Vector3"}},
      {"geometry_msgs/AccelStamped",
       "std_msgs/Header header\ngeometry_msgs/Accel accel\n",
       {"std_msgs/Header", "geometry_msgs/Accel", "geometry_msgs/Vector3"}},
      {"tf2_msgs/TFMessage",
       "geometry_msgs/TransformStamped[] transforms\n",
       {"geometry_msgs/TransformStamped", "std_msgs/Header", "geometry_msgs/Transform", "geometry_msgs/Vector3",
        "geometry_msgs/Quaternion"}},
      {"esim_msgs/OpticFlow",
       "# Motion field, px/s, row by row from the upper left corner: x to the right, y downwards.\n"
       "std_msgs/Header header\nuint32 height\nuint32 width\nfloat32[] flow_x\nfloat32[] flow_y\n",
       {"std_msgs/Header"}},
      {"esim_msgs/FrameInfo",
       "# How the frame with the same stamp, the middle of its exposure, was exposed.\n"
       "std_msgs/Header header\nint64 exposure_start_ns\nint64 exposure_duration_ns\nfloat64 gain\nuint8 bits\n",
       {"std_msgs/Header"}},
      {"event_camera_msgs/EventPacket",
       "std_msgs/Header header\nuint32 height\nuint32 width\nuint64 seq\nuint64 time_base\nstring encoding\n"
       "bool is_bigendian\nuint8[] events\n",
       {"std_msgs/Header"}},

      {"rosgraph_msgs/Clock", "time clock\n", {}, "builtin_interfaces/Time clock\n"},
      {"nav_msgs/Odometry",
       "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
       "geometry_msgs/TwistWithCovariance twist\n",
       {"std_msgs/Header", "geometry_msgs/PoseWithCovariance", "geometry_msgs/Pose", "geometry_msgs/Point",
        "geometry_msgs/Quaternion", "geometry_msgs/TwistWithCovariance", "geometry_msgs/Twist",
        "geometry_msgs/Vector3"}},

      {"dvs_msgs/Event",
       "uint16 x\nuint16 y\ntime ts\nbool polarity\n",
       {},
       "uint16 x\nuint16 y\nbuiltin_interfaces/Time ts\nbool polarity\n"},
      {"std_msgs/Header",
       "uint32 seq\ntime stamp\nstring frame_id\n",
       {},
       "builtin_interfaces/Time stamp\nstring frame_id\n"},
      {"builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"},
      {"sensor_msgs/RegionOfInterest",
       "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n"},
      {"geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"},
      {"geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"},
      {"geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"},
      {"geometry_msgs/Pose", "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"},
      {"geometry_msgs/PoseWithCovariance", "geometry_msgs/Pose pose\nfloat64[36] covariance\n"},
      {"geometry_msgs/TwistWithCovariance", "geometry_msgs/Twist twist\nfloat64[36] covariance\n"},
      {"geometry_msgs/Twist", "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n"},
      {"geometry_msgs/Accel", "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n"},
      {"geometry_msgs/Transform", "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"},
      {"geometry_msgs/TransformStamped",
       "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n"},
  };
  return all;
}

const Definition& definition_named(std::string_view name) {
  for (const Definition& definition : definitions()) {
    if (definition.name == name) return definition;
  }
  return definitions().front();  // not reached: all names are in this file
}

const Known& known(MessageType type) { return kKnown[static_cast<std::size_t>(type)]; }

std::string_view text_of(const Definition& definition, Encoding encoding) {
  return encoding == Encoding::cdr && !definition.ros2_text.empty() ? definition.ros2_text : definition.text;
}

}  // namespace

std::string_view name_of(MessageType type) { return known(type).name; }
std::string_view md5_of(MessageType type) { return known(type).md5; }

std::string ros2_name_of(MessageType type) {
  std::string name(name_of(type));
  return name.insert(name.find('/'), "/msg");
}

std::optional<MessageType> type_named(std::string_view name) {
  std::string plain(name);
  if (const std::size_t part = plain.find("/msg/"); part != std::string::npos) plain.erase(part, 4);
  for (const Known& entry : kKnown) {
    if (entry.name == plain) return entry.type;
  }
  return std::nullopt;
}

std::string known_names() {
  std::string names;
  for (const Known& entry : kKnown) names += (names.empty() ? "" : ", ") + std::string(entry.name);
  return names;
}

std::string definition_of(MessageType type, Encoding encoding) {
  const Definition& whole = definition_named(name_of(type));
  std::string text(text_of(whole, encoding));
  const auto add = [&](std::string_view name) {
    text += std::string(80, '=') + "\nMSG: " + std::string(name) + "\n";
    text += text_of(definition_named(name), encoding);
  };
  for (const std::string_view part : whole.parts) add(part);
  if (encoding == Encoding::cdr) add("builtin_interfaces/Time");  // part of every header
  return text;
}

}  // namespace esim::inline formats::ros
