#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "esim/dataset/sequence.h"
#include "esim/formats/datasets/shard.h"

namespace esim::inline dataset {

/// The contents of a sequence in addition to its events.
struct DatasetContents {
  bool motion_field = true;
  bool optical_flow = true;
  bool depth = false;
  bool images = false;  ///< at the start and at the end, 8-bit sRGB
  bool tensor = false;  ///< EV-FlowNet's four channels
  int voxel_bins = 0;   ///< 0: no voxel grid
};

/// The present name of one of the contents: "motion_field" for "flow", "optical_flow" for "displacement".
std::string present_content_name(const std::string& name);

/// Parses "motion_field", "optical_flow", "depth", "images", "tensor", "voxels" (5 bins) or "voxels=BINS". Throws
/// UserError for any other name. Old names are valid.
DatasetContents contents_named(const std::vector<std::string>& names);

/// The inverse of contents_named().
std::vector<std::string> names_of(const DatasetContents& contents);

/// The arrays of a sequence as they are written. Borrows from `sequence` and owns derived arrays.
class SequenceArrays {
 public:
  /// Throws UserError if the sequence lacks one of the contents.
  SequenceArrays(const Sequence& sequence, const DatasetContents& contents);
  ~SequenceArrays();

  const ShardSequence& shard_sequence() const { return shard_sequence_; }

 private:
  struct Made;
  void add_pair(const std::string& name, const Image<float>& first, const Image<float>& second, const char* about);

  std::unique_ptr<Made> made_;
  ShardSequence shard_sequence_;
};

}  // namespace esim::inline dataset
