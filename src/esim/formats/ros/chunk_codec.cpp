#include "esim/formats/ros/chunk_codec.h"

#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <memory>

#include "esim/core/error.h"
#include "esim/formats/ros/messages/bytes.h"

namespace esim::inline formats::ros {
namespace {

constexpr int kZstdLevel = 1;
constexpr std::size_t kFirstBytes = 1U << 20;

[[noreturn]] void fail() { throw Malformed("its compressed data are damaged"); }

/// One step of decompression: consumes the start of both; returns true at the end of the data.
template <typename Step>
void decompress_in_steps(std::span<const std::byte> in, std::uint64_t size, std::vector<std::byte>& raw, Step step) {
  raw.resize(std::min<std::uint64_t>(size, kFirstBytes));
  std::size_t filled = 0;
  for (bool ended = false; !ended;) {
    if (filled == raw.size() && filled < size) raw.resize(std::min<std::uint64_t>(size, 2 * raw.size()));
    std::span<std::byte> out(raw.data() + filled, raw.size() - filled);
    const std::size_t in_before = in.size(), out_before = out.size();
    ended = step(in, out);
    filled += out_before - out.size();
    if (!ended && in.size() == in_before && out.size() == out_before) fail();
  }
  if (filled != size) fail();
}

void decompress_lz4(std::span<const std::byte> packed, std::uint64_t size, std::vector<std::byte>& raw) {
  LZ4F_dctx* created = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&created, LZ4F_VERSION))) fail();
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(created,
                                                                                     &LZ4F_freeDecompressionContext);
  decompress_in_steps(packed, size, raw, [&](std::span<const std::byte>& in, std::span<std::byte>& out) {
    std::size_t used = in.size(), made = out.size();
    const std::size_t left = LZ4F_decompress(context.get(), out.data(), &made, in.data(), &used, nullptr);
    if (LZ4F_isError(left)) fail();
    in = in.subspan(used), out = out.subspan(made);
    return left == 0;
  });
}

void decompress_zstd(std::span<const std::byte> packed, std::uint64_t size, std::vector<std::byte>& raw) {
  const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(ZSTD_createDCtx(), &ZSTD_freeDCtx);
  decompress_in_steps(packed, size, raw, [&](std::span<const std::byte>& in, std::span<std::byte>& out) {
    ZSTD_inBuffer input{in.data(), in.size(), 0};
    ZSTD_outBuffer output{out.data(), out.size(), 0};
    const std::size_t left = ZSTD_decompressStream(context.get(), &output, &input);
    if (ZSTD_isError(left)) fail();
    in = in.subspan(input.pos), out = out.subspan(output.pos);
    return left == 0;
  });
}

void decompress_bz2(std::span<const std::byte> packed, std::uint64_t size, std::vector<std::byte>& raw) {
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) fail();
  const std::unique_ptr<bz_stream, decltype(&BZ2_bzDecompressEnd)> ending(&stream, &BZ2_bzDecompressEnd);
  decompress_in_steps(packed, size, raw, [&](std::span<const std::byte>& in, std::span<std::byte>& out) {
    stream.next_in = const_cast<char*>(as_text(in).data());
    stream.avail_in = static_cast<unsigned>(in.size());
    stream.next_out = reinterpret_cast<char*>(out.data());
    stream.avail_out = static_cast<unsigned>(out.size());
    const int status = BZ2_bzDecompress(&stream);
    if (status != BZ_OK && status != BZ_STREAM_END) fail();
    in = in.last(stream.avail_in), out = out.last(stream.avail_out);
    return status == BZ_STREAM_END;
  });
}

void compress_lz4(std::string_view raw, std::string& packed) {
  LZ4F_preferences_t preferences{};
  preferences.frameInfo.blockSizeID = LZ4F_max1MB;
  preferences.frameInfo.blockMode = LZ4F_blockIndependent;
  preferences.frameInfo.contentChecksumFlag = LZ4F_contentChecksumEnabled;
  packed.resize(LZ4F_compressFrameBound(raw.size(), &preferences));
  const std::size_t size = LZ4F_compressFrame(packed.data(), packed.size(), raw.data(), raw.size(), &preferences);
  if (LZ4F_isError(size)) throw InternalError(std::string("LZ4: ") + LZ4F_getErrorName(size));
  packed.resize(size);
}

void compress_zstd(std::string_view raw, std::string& packed) {
  packed.resize(ZSTD_compressBound(raw.size()));
  const std::size_t size = ZSTD_compress(packed.data(), packed.size(), raw.data(), raw.size(), kZstdLevel);
  if (ZSTD_isError(size)) throw InternalError(std::string("Zstandard: ") + ZSTD_getErrorName(size));
  packed.resize(size);
}

}  // namespace

std::string_view compress(ChunkCodec codec, std::string_view raw, std::string& buffer) {
  switch (codec) {
    case ChunkCodec::none:
      return raw;
    case ChunkCodec::lz4:
      compress_lz4(raw, buffer);
      break;
    case ChunkCodec::zstd:
      compress_zstd(raw, buffer);
      break;
    case ChunkCodec::bz2:
      throw InternalError("chunks are not written with bzip2");
  }
  return buffer;
}

std::span<const std::byte> decompress(ChunkCodec codec, std::span<const std::byte> packed, std::uint64_t size,
                                      std::vector<std::byte>& buffer) {
  if (size > kMaxChunkBytes) throw Malformed("its stated size is larger than any chunk");
  switch (codec) {
    case ChunkCodec::none:
      if (packed.size() != size) throw Malformed("its size differs from its stated size");
      return packed;
    case ChunkCodec::lz4:
      decompress_lz4(packed, size, buffer);
      break;
    case ChunkCodec::zstd:
      decompress_zstd(packed, size, buffer);
      break;
    case ChunkCodec::bz2:
      decompress_bz2(packed, size, buffer);
      break;
  }
  return buffer;
}

}  // namespace esim::inline formats::ros
