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
  bool flow = true;
  bool displacement = true;
  bool depth = false;
  bool images = false;  ///< at the start and at the end, 8-bit sRGB
  bool tensor = false;  ///< EV-FlowNet's four channels
  int voxel_bins = 0;   ///< 0: no voxel grid
};

/// Parses "flow", "displacement", "depth", "images", "tensor", "voxels" (5 bins) or "voxels=BINS". Throws UserError
/// for any other name.
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
