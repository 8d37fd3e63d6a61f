#pragma once

#include <epoxy/gl.h>

#include "esim/backends/opengl/gl_buffer.h"

// Private to backends/opengl: includes epoxy/gl.h.
namespace esim::inline backends::inline opengl {

/// The splats in each bin of an image, from front to back, on the device. Equally distant splats are in the order of
/// their numbers. Belongs to the current context.
///
/// The visible splats are sorted by their distance first, and then copied into the bins that they may touch. This
/// longer list is sorted by bins, stably.
class GlSplatLists {
 public:
  /// For images of so many bins.
  GlSplatLists(GLuint splats, GLuint columns, GLuint rows);

  /// Binds kBoxes, kOrders and kValues, into which a projection writes for each splat.
  void bind_for_projection() const;

  /// Makes the lists from these, and binds them: kItemsIn and kRanges.
  void make();

  /// Makes room for so many splats, counted once per bin. Throws UserError if the device cannot.
  void make_room(std::size_t items);

  GLuint max_items() const { return max_items_; }

  /// Copies how many splats there are, counted once per bin, as a uint to a buffer of the context. If there are more
  /// than max_items(), the last ones are missing.
  void copy_wanted(GLuint buffer) const;

 private:
  enum Length : int { kVisible = 0, kListed = 16 };  // places of the two lists in lengths_

  void prefix_sums(int length, GLuint factor, GLintptr groups, int list, GLuint list_size);
  void sort(Length length, int bits, int max_bits);
  void swap_items();
  void dispatch(GLintptr groups) const;

  GLuint splats_, columns_, rows_, max_items_ = 0;
  GLuint prefix_of_blocks_, prefix_of_sums_, prefix_in_blocks_;
  GLuint visible_, count_, bins_, ranges_of_bins_, digits_, reorder_;
  GlBuffer boxes_, orders_, values_, sums_, lengths_, ranges_;
  GlBuffer items_in_, items_out_;
};

/// What shaders have written becomes visible to later ones.
void gl_barrier();

}  // namespace esim::inline backends::inline opengl
