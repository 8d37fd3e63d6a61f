#include "esim/dataset/files/contents.h"

#include <fmt/format.h>

#include <charconv>
#include <deque>

#include "esim/core/colour/srgb.h"
#include "esim/core/error.h"
#include "esim/represent/representations.h"

namespace esim::inline dataset {
namespace {

constexpr int kUsualBins = 5, kMaxVoxelBins = 100;

int bins_named(std::string_view text) {
  int bins = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), bins);
  if (error != std::errc() || end != text.data() + text.size() || bins < 1 || bins > kMaxVoxelBins)
    throw UserError(fmt::format("voxels={}: must be a number of bins from 1 to {}", text, kMaxVoxelBins));
  return bins;
}

}  // namespace

std::string present_content_name(const std::string& name) {
  if (name == "flow") return "motion_field";
  if (name == "displacement") return "optical_flow";
  return name;
}

DatasetContents contents_named(const std::vector<std::string>& names) {
  DatasetContents contents{.motion_field = false, .optical_flow = false};
  for (const std::string& given : names) {
    const std::string name = present_content_name(given);
    if (name == "motion_field") {
      contents.motion_field = true;
    } else if (name == "optical_flow") {
      contents.optical_flow = true;
    } else if (name == "depth") {
      contents.depth = true;
    } else if (name == "images") {
      contents.images = true;
    } else if (name == "tensor") {
      contents.tensor = true;
    } else if (name == "voxels" || name.starts_with("voxels=")) {
      contents.voxel_bins = name == "voxels" ? kUsualBins : bins_named(std::string_view(name).substr(7));
    } else if (name != "events") {
      throw UserError(fmt::format(
          "contents: must be of events, motion_field, optical_flow, depth, images, tensor and voxels=BINS, not '{}'",
          name));
    }
  }
  return contents;
}

std::vector<std::string> names_of(const DatasetContents& contents) {
  std::vector<std::string> names{"events"};
  if (contents.motion_field) names.emplace_back("motion_field");
  if (contents.optical_flow) names.emplace_back("optical_flow");
  if (contents.depth) names.emplace_back("depth");
  if (contents.images) names.emplace_back("images");
  if (contents.tensor) names.emplace_back("tensor");
  if (contents.voxel_bins > 0) names.push_back(fmt::format("voxels={}", contents.voxel_bins));
  return names;
}

struct SequenceArrays::Made {
  std::vector<std::int64_t> t;
  std::vector<std::uint16_t> x, y;
  std::vector<std::int8_t> p;
  std::deque<std::vector<float>> floats;
  std::vector<std::uint8_t> images;
};

SequenceArrays::SequenceArrays(const Sequence& sequence, const DatasetContents& contents)
    : made_(std::make_unique<Made>()), shard_sequence_{sequence.index, {}, sequence.info} {
  std::vector<ShardArray>& arrays = shard_sequence_.arrays;
  const std::size_t count = sequence.events.size();
  made_->t.reserve(count), made_->x.reserve(count), made_->y.reserve(count), made_->p.reserve(count);
  for (const Event& event : sequence.events) {
    made_->t.push_back(event.t - sequence.span.start);
    made_->x.push_back(event.x);
    made_->y.push_back(event.y);
    made_->p.push_back(event.polarity);
  }
  const auto ragged = [&]<typename T>(const char* name, const std::vector<T>& numbers, const char* about) {
    arrays.push_back({name, kNumberType<T>, {count}, numbers.data(), true, about});
  };
  ragged("events/t", made_->t, "ns since the start of the sequence");
  ragged("events/x", made_->x, "px");
  ragged("events/y", made_->y, "px");
  ragged("events/p", made_->p, "1: brighter, -1: darker");

  if (contents.motion_field)
    add_pair("motion_field", sequence.motion_field.x, sequence.motion_field.y,
             "motion field at motion_field_t, px/s: to the right, downwards");
  if (contents.optical_flow) {
    add_pair("optical_flow", sequence.optical_flow.x, sequence.optical_flow.y,
             "from the start to the end, px: to the right, downwards; NaN outside the image");
  }
  const auto width = static_cast<std::uint64_t>(sequence.width), height = static_cast<std::uint64_t>(sequence.height);
  if (contents.depth) {
    if (sequence.depth.empty()) throw UserError("contents: these sequences have no depth; remove it");
    arrays.push_back({"depth",
                      NumberType::float32,
                      {height, width},
                      sequence.depth.data(),
                      false,
                      "m along the optical axis, at the start; inf without a surface"});
  }
  if (contents.images) {
    for (const Image<float>* image : {&sequence.first, &sequence.last}) {
      if (image->empty()) throw UserError("contents: these sequences have no images; remove them");
      const Image<std::uint8_t> coded = encode_srgb(*image);
      made_->images.insert(made_->images.end(), coded.pixels().begin(), coded.pixels().end());
    }
    arrays.push_back({"images",
                      NumberType::uint8,
                      {2, height, width},
                      made_->images.data(),
                      false,
                      "at the start and at the end, sRGB"});
  }
  const auto stack = [&](const char* name, ImageStack<float> images, const char* about) {
    made_->floats.push_back(std::move(images.values));
    arrays.push_back({name,
                      NumberType::float32,
                      {static_cast<std::uint64_t>(images.count), height, width},
                      made_->floats.back().data(),
                      false,
                      about});
  };
  if (contents.tensor) {
    stack("tensor", count_and_stamp(sequence.events, sequence.width, sequence.height, sequence.span, StampChoice::last),
          "counts of ON and OFF events, and the time of the latest, from 0 to 1 (EV-FlowNet)");
  }
  if (contents.voxel_bins > 0) {
    stack("voxels", voxel_grid(sequence.events, sequence.width, sequence.height, contents.voxel_bins, sequence.span),
          "polarities in time bins (Zhu et al., CVPR 2019)");
  }
}

SequenceArrays::~SequenceArrays() = default;

void SequenceArrays::add_pair(const std::string& name, const Image<float>& first, const Image<float>& second,
                              const char* about) {
  if (first.empty()) throw UserError(fmt::format("contents: these sequences have no {}; remove it", name));
  std::vector<float>& both = made_->floats.emplace_back(first.pixels().begin(), first.pixels().end());
  both.insert(both.end(), second.pixels().begin(), second.pixels().end());
  shard_sequence_.arrays.push_back(
      {name,
       NumberType::float32,
       {2, static_cast<std::uint64_t>(first.height()), static_cast<std::uint64_t>(first.width())},
       both.data(),
       false,
       about});
}

}  // namespace esim::inline dataset
