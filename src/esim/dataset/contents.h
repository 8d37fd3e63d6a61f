#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "esim/dataset/sequence.h"
#include "esim/record/formats/shard.h"

namespace esim {

/// What is written of a sequence beside its events.
struct DatasetContents {
  bool flow = true;
  bool displacement = true;
  bool depth = false;
  bool images = false;  ///< at the start and at the end, 8 bits, sRGB
  bool tensor = false;  ///< EV-FlowNet's four channels
  int voxel_bins = 0;   ///< 0: no voxel grid
};

/// "flow", "displacement", "depth", "images", "tensor", "voxels" or "voxels=BINS", which has 5 otherwise. Throws
/// UserError naming what is none of them.
DatasetContents contents_named(const std::vector<std::string>& names);

/// The same names of contents.
std::vector<std::string> names_of(const DatasetContents& contents);

/// A sequence as it is written. Borrows from `sequence`, and owns what is made of it.
class SequenceArrays {
 public:
  /// Throws UserError where the sequence has not what is wanted.
  SequenceArrays(const Sequence& sequence, const DatasetContents& contents);
  ~SequenceArrays();

  const ShardSequence& shard_sequence() const { return shard_sequence_; }

 private:
  struct Made;
  void add_pair(const std::string& name, const Image<float>& first, const Image<float>& second, const char* about);

  std::unique_ptr<Made> made_;
  ShardSequence shard_sequence_;
};

}  // namespace esim
