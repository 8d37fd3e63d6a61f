#include "esim/backends/opengl/splats/gl_splat_shaders.h"

namespace esim::inline backends::inline opengl {

// All integers, and no result depends on the order of atomic operations, so that lists are the same every time.

const char* const kPrefixShader = R"(
layout(local_size_x = kGroup) in;
layout(std430, binding = 5) restrict buffer Values { uint values[]; };
layout(std430, binding = 6) restrict buffer Sums { uint sums[]; };
layout(std430, binding = 7) restrict buffer Lengths { uint lengths[]; };

uniform int length_at;  // of the number of values: in `lengths`; -1: it is `factor`
uniform uint factor;    // on that number

const uint kEach = kBlock / kGroup;  // values per invocation
shared uint parts[kGroup];

uint value_count() { return length_at < 0 ? factor : lengths[length_at] * factor; }

// Sums stop at the largest number, so that too many can be noticed.
uint sum_of(uint a, uint b) {
  uint sum = a + b;
  return sum < a ? 0xffffffffu : sum;
}

// The sum of the values of all previous invocations of the workgroup; `total`: of all.
uint sum_before(uint value, out uint total) {
  uint me = gl_LocalInvocationIndex;
  parts[me] = value;
  barrier();
  for (uint distance = 1; distance < kGroup; distance *= 2) {
    uint other = me >= distance ? parts[me - distance] : 0u;
    barrier();
    parts[me] = sum_of(parts[me], other);
    barrier();
  }
  uint before = me > 0 ? parts[me - 1] : 0u;
  total = parts[kGroup - 1];
  barrier();
  return before;
}
)";

const char* const kPrefixOfBlocksShader = R"(
void main() {
  uint count = value_count(), at = gl_WorkGroupID.x * kBlock + gl_LocalInvocationIndex * kEach, sum = 0, total;
  for (uint i = at; i < min(at + kEach, count); ++i) sum = sum_of(sum, values[i]);
  sum_before(sum, total);
  if (gl_LocalInvocationIndex == 0) sums[gl_WorkGroupID.x] = total;
}
)";

// The layout of a list's lengths is that of GlSplatLists.
const char* const kPrefixOfSumsShader = R"(
uniform int list_at;     // of the list whose length the sum of all values is: in `lengths`; -1: none
uniform uint max_items;  // in that list

void main() {
  uint blocks = (value_count() + kBlock - 1) / kBlock, carried = 0, total;
  for (uint start = 0; start < blocks; start += kGroup) {
    uint i = start + gl_LocalInvocationIndex;
    uint before = sum_before(i < blocks ? sums[i] : 0u, total);
    if (i < blocks) sums[i] = sum_of(carried, before);
    carried = sum_of(carried, total);
  }
  if (gl_LocalInvocationIndex > 0 || list_at < 0) return;
  uint items = min(carried, max_items), item_blocks = (items + kBlock - 1) / kBlock;
  lengths[list_at] = items, lengths[list_at + 1] = carried, lengths[list_at + 2] = item_blocks;
  lengths[list_at + 4] = (items + kGroup - 1) / kGroup, lengths[list_at + 5] = lengths[list_at + 6] = 1;
  lengths[list_at + 8] = item_blocks, lengths[list_at + 9] = lengths[list_at + 10] = 1;
  lengths[list_at + 12] = (item_blocks * kDigits + kBlock - 1) / kBlock;
  lengths[list_at + 13] = lengths[list_at + 14] = 1;
}
)";

const char* const kPrefixInBlocksShader = R"(
void main() {
  uint count = value_count(), at = gl_WorkGroupID.x * kBlock + gl_LocalInvocationIndex * kEach, sum = 0, total;
  if (gl_WorkGroupID.x * kBlock >= count) return;
  for (uint i = at; i < min(at + kEach, count); ++i) sum = sum_of(sum, values[i]);
  uint before = sum_of(sums[gl_WorkGroupID.x], sum_before(sum, total));
  for (uint i = at; i < min(at + kEach, count); ++i) {
    uint value = values[i];
    values[i] = before;
    before = sum_of(before, value);
  }
}
)";

const char* const kVisibleShader = R"(
layout(local_size_x = kGroup) in;
layout(std430, binding = 1) writeonly restrict buffer ItemsOut { uvec2 items_out[]; };
layout(std430, binding = 4) readonly restrict buffer Orders { uint orders[]; };
layout(std430, binding = 5) readonly restrict buffer Values { uint values[]; };
uniform uint count;

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i < count && orders[i] != 0) items_out[values[i]] = uvec2(orders[i], i);
}
)";

const char* const kCountShader = R"(
layout(local_size_x = kGroup) in;
layout(std430, binding = 0) readonly restrict buffer ItemsIn { uvec2 items_in[]; };
layout(std430, binding = 3) readonly restrict buffer Boxes { uvec2 boxes[]; };
layout(std430, binding = 5) writeonly restrict buffer Values { uint values[]; };
layout(std430, binding = 7) readonly restrict buffer Lengths { uint lengths[]; };

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= lengths[0]) return;
  uvec2 box = boxes[items_in[i].y], bins = (box >> 16) - (box & 0xffffu) + 1;
  values[i] = bins.x * bins.y;
}
)";

const char* const kBinsShader = R"(
layout(local_size_x = kGroup) in;
layout(std430, binding = 0) readonly restrict buffer ItemsIn { uvec2 items_in[]; };
layout(std430, binding = 1) writeonly restrict buffer ItemsOut { uvec2 items_out[]; };
layout(std430, binding = 3) readonly restrict buffer Boxes { uvec2 boxes[]; };
layout(std430, binding = 5) readonly restrict buffer Values { uint values[]; };
layout(std430, binding = 7) readonly restrict buffer Lengths { uint lengths[]; };
uniform uint columns, max_items;

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= lengths[0]) return;
  uint splat = items_in[i].y, to = values[i];
  uvec2 box = boxes[splat], from = box & 0xffffu, last = box >> 16;
  for (uint row = from.y; row <= last.y; ++row) {
    for (uint column = from.x; column <= last.x && to < max_items; ++column, ++to)
      items_out[to] = uvec2(row * columns + column, splat);
  }
}
)";

const char* const kRangesShader = R"(
layout(local_size_x = kGroup) in;
layout(std430, binding = 0) readonly restrict buffer ItemsIn { uvec2 items_in[]; };
layout(std430, binding = 5) writeonly restrict buffer Ranges { uint ranges[]; };
layout(std430, binding = 7) readonly restrict buffer Lengths { uint lengths[]; };
uniform int length_at;

void main() {
  uint i = gl_GlobalInvocationID.x, count = lengths[length_at];
  if (i >= count) return;
  uint bin = items_in[i].x;
  if (i == 0 || items_in[i - 1].x != bin) ranges[2 * bin] = i;
  if (i + 1 == count || items_in[i + 1].x != bin) ranges[2 * bin + 1] = i + 1;
}
)";

const char* const kDigitsShader = R"(
layout(local_size_x = kGroup) in;
layout(std430, binding = 0) readonly restrict buffer ItemsIn { uvec2 items_in[]; };
layout(std430, binding = 5) writeonly restrict buffer Values { uint values[]; };
layout(std430, binding = 7) readonly restrict buffer Lengths { uint lengths[]; };
uniform int length_at;
uniform uint shift, digits;
shared uint counts[kDigits];

void main() {
  uint me = gl_LocalInvocationIndex, block = gl_WorkGroupID.x;
  for (uint digit = me; digit < digits; digit += kGroup) counts[digit] = 0;
  barrier();
  uint count = lengths[length_at], blocks = lengths[length_at + 2];
  for (uint i = block * kBlock + me; i < min((block + 1) * kBlock, count); i += kGroup)
    atomicAdd(counts[items_in[i].x >> shift & (digits - 1)], 1u);
  barrier();
  for (uint digit = me; digit < digits; digit += kGroup) values[digit * blocks + block] = counts[digit];
}
)";

// In each round, an item finds the earlier ones with the same digit in a mask of the workgroup's invocations.
const char* const kReorderShader = R"(
layout(local_size_x = kGroup) in;
layout(std430, binding = 0) readonly restrict buffer ItemsIn { uvec2 items_in[]; };
layout(std430, binding = 1) writeonly restrict buffer ItemsOut { uvec2 items_out[]; };
layout(std430, binding = 5) readonly restrict buffer Values { uint values[]; };
layout(std430, binding = 7) readonly restrict buffer Lengths { uint lengths[]; };
uniform int length_at;
uniform uint shift, digits;
const uint kWords = kGroup / 32;
shared uint masks[kDigits * kWords], next[kDigits];

void main() {
  uint me = gl_LocalInvocationIndex, block = gl_WorkGroupID.x;
  uint count = lengths[length_at], blocks = lengths[length_at + 2];
  for (uint digit = me; digit < digits; digit += kGroup) next[digit] = values[digit * blocks + block];
  for (uint start = block * kBlock; start < min((block + 1) * kBlock, count); start += kGroup) {
    for (uint i = me; i < digits * kWords; i += kGroup) masks[i] = 0;
    barrier();
    bool present = start + me < count;
    uvec2 item = present ? items_in[start + me] : uvec2(0);
    uint digit = item.x >> shift & (digits - 1), word = me / 32, bit = me % 32;
    if (present) atomicOr(masks[digit * kWords + word], 1u << bit);
    barrier();
    uint before = 0, same = 0;
    if (present) {
      for (uint i = 0; i < kWords; ++i) {
        uint mask = masks[digit * kWords + i];
        same += bitCount(mask);
        before += bitCount(i < word ? mask : i == word ? mask & ((1u << bit) - 1) : 0u);
      }
      items_out[next[digit] + before] = item;
    }
    barrier();
    if (present && before + 1 == same) next[digit] += same;
  }
}
)";

}  // namespace esim::inline backends::inline opengl
