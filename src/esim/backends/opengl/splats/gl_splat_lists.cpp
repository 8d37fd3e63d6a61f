#include "esim/backends/opengl/splats/gl_splat_lists.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <string>
#include <utility>

#include "esim/backends/opengl/gl_context.h"
#include "esim/backends/opengl/gl_program.h"
#include "esim/backends/opengl/splats/gl_splat_scene.h"
#include "esim/backends/opengl/splats/gl_splat_shaders.h"

namespace esim::inline backends::inline opengl {
namespace {

// The lengths of a list, in uints from its place: its length, the one that it should have, its blocks; then three
// numbers of workgroups each, for glDispatchComputeIndirect:
constexpr GLintptr kGroups = 4;        // an invocation per item
constexpr GLintptr kBlocks = 8;        // a workgroup per block of items
constexpr GLintptr kDigitBlocks = 12;  // a workgroup per block of the counts of digits
constexpr std::size_t kLengthCount = 32;

constexpr std::size_t kItemBytes = 2 * sizeof(std::uint32_t);

GLuint divided_up(GLuint value, GLuint by) { return (value + by - 1) / by; }

}  // namespace

void gl_barrier() {
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_COMMAND_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
}

GlSplatLists::GlSplatLists(GLuint splats, GLuint columns, GLuint rows)
    : splats_(splats), columns_(columns), rows_(rows) {
  const std::string rules = gl_splat_rules();
  const auto program = [&](const char* shader) { return make_compute_program({rules.c_str(), shader}); };
  const auto prefix = [&](const char* shader) { return make_compute_program({rules.c_str(), kPrefixShader, shader}); };
  prefix_of_blocks_ = prefix(kPrefixOfBlocksShader);
  prefix_of_sums_ = prefix(kPrefixOfSumsShader);
  prefix_in_blocks_ = prefix(kPrefixInBlocksShader);
  visible_ = program(kVisibleShader), count_ = program(kCountShader), bins_ = program(kBinsShader);
  ranges_of_bins_ = program(kRangesShader), digits_ = program(kDigitsShader), reorder_ = program(kReorderShader);
  boxes_.make_room(splats * 2 * sizeof(std::uint32_t));
  orders_.make_room(splats * sizeof(std::uint32_t));
  lengths_.make_room(kLengthCount * sizeof(std::uint32_t));
  ranges_.make_room(std::size_t{columns} * rows * 2 * sizeof(std::uint32_t));
  constexpr std::size_t kItemsPerSplat = 2, kMinItems = 1 << 16;
  make_room(std::max(kMinItems, kItemsPerSplat * splats));
}

void GlSplatLists::make_room(std::size_t items) {
  require_gl_items(items, kItemBytes);
  items = std::min(items + items / 2, max_gl_items(kItemBytes));  // for the next images
  max_items_ = static_cast<GLuint>(items);
  items_in_.make_room(items * kItemBytes);
  items_out_.make_room(items * kItemBytes);
  const GLuint digit_counts = divided_up(max_items_, kGlBlock) << kGlMaxBits;
  const GLuint values = std::max(splats_, digit_counts);
  values_.make_room(values * sizeof(std::uint32_t));
  sums_.make_room(divided_up(values, kGlBlock) * sizeof(std::uint32_t));
  throw_on_gl_error("lists of splats");
}

void GlSplatLists::bind_for_projection() const {
  boxes_.bind(kBoxes);
  orders_.bind(kOrders);
  values_.bind(kValues);
}

/// With the numbers of workgroups for a list, in the buffer of lengths.
void GlSplatLists::dispatch(GLintptr groups) const {
  glDispatchComputeIndirect(groups * static_cast<GLintptr>(sizeof(std::uint32_t)));
  gl_barrier();
}

void GlSplatLists::swap_items() {
  std::swap(items_in_, items_out_);
  items_in_.bind(kItemsIn);
  items_out_.bind(kItemsOut);
}

/// Replaces values by the sums of those before them. `length` and `factor`: how many there are, as in the shader;
/// `groups`: for their blocks. `list`: the list whose length is their sum, of at most `list_size`; -1: none.
void GlSplatLists::prefix_sums(int length, GLuint factor, GLintptr groups, int list, GLuint list_size) {
  for (const GLuint program : {prefix_of_blocks_, prefix_of_sums_, prefix_in_blocks_}) {
    glUseProgram(program);
    set(program, "length_at", length);
    set(program, "factor", factor);
    if (program == prefix_of_sums_) {
      set(program, "list_at", list);
      set(program, "max_items", list_size);
      glDispatchCompute(1, 1, 1);
      gl_barrier();
    } else if (length < 0) {
      glDispatchCompute(divided_up(factor, kGlBlock), 1, 1);
      gl_barrier();
    } else {
      dispatch(groups);
    }
  }
}

/// Sorts the items stably by the lowest bits of their keys.
void GlSplatLists::sort(Length length, int bits, int max_bits) {
  const int passes = (bits + max_bits - 1) / max_bits, each = passes > 0 ? (bits + passes - 1) / passes : 0;
  for (int pass = 0; pass < passes; ++pass) {
    const GLuint digits = 1U << each;
    const auto run = [&](GLuint program) {
      glUseProgram(program);
      set(program, "length_at", length);
      set(program, "shift", static_cast<GLuint>(pass * each));
      set(program, "digits", digits);
      dispatch(length + kBlocks);
    };
    run(digits_);
    prefix_sums(length + 2, digits, length + kDigitBlocks, -1, 0);
    run(reorder_);
    swap_items();
  }
}

void GlSplatLists::make() {
  constexpr GLuint kZero = 0;
  constexpr int kDistanceBits = 32, kDistanceDigit = 8;
  glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, lengths_.name());
  lengths_.bind(kLengths);
  sums_.bind(kSums);
  items_in_.bind(kItemsIn);
  items_out_.bind(kItemsOut);

  // The visible splats, by distance
  prefix_sums(-1, splats_, 0, kVisible, splats_);
  glUseProgram(visible_);
  set(visible_, "count", splats_);
  glDispatchCompute(divided_up(splats_, kGlGroup), 1, 1);
  gl_barrier();
  swap_items();
  sort(kVisible, kDistanceBits, kDistanceDigit);

  // The same in bins
  glUseProgram(count_);
  dispatch(kVisible + kGroups);
  prefix_sums(kVisible, 1, kVisible + kBlocks, kListed, max_items_);
  glUseProgram(bins_);
  set(bins_, "columns", columns_);
  set(bins_, "max_items", max_items_);
  dispatch(kVisible + kGroups);
  swap_items();
  sort(kListed, std::bit_width(columns_ * rows_ - 1), kGlMaxBits);

  glClearNamedBufferData(ranges_.name(), GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, &kZero);
  ranges_.bind(kRanges);
  glUseProgram(ranges_of_bins_);
  set(ranges_of_bins_, "length_at", static_cast<int>(kListed));
  dispatch(kListed + kGroups);
}

void GlSplatLists::copy_wanted(GLuint buffer) const {
  constexpr GLintptr kWanted = (kListed + 1) * sizeof(std::uint32_t);
  glCopyNamedBufferSubData(lengths_.name(), buffer, kWanted, 0, sizeof(std::uint32_t));
}

}  // namespace esim::inline backends::inline opengl
