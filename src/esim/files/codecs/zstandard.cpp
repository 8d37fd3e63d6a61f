#include "esim/files/codecs/zstandard.h"

#include <zstd.h>

#include <memory>
#include <new>

#include "esim/core/error.h"

namespace esim::inline files {

void compress_zstandard(std::string_view bytes, int level, std::string& frame) {
  const std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context(ZSTD_createCCtx(), ZSTD_freeCCtx);
  if (context == nullptr) throw std::bad_alloc();
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, level);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
  frame.resize(ZSTD_compressBound(bytes.size()));
  const std::size_t size = ZSTD_compress2(context.get(), frame.data(), frame.size(), bytes.data(), bytes.size());
  if (ZSTD_isError(size) != 0) throw InternalError(std::string("Zstandard: ") + ZSTD_getErrorName(size));
  frame.resize(size);
}

std::uint64_t zstandard_content_size(std::string_view frame) {
  const unsigned long long size = ZSTD_getFrameContentSize(frame.data(), frame.size());
  return size == ZSTD_CONTENTSIZE_UNKNOWN || size == ZSTD_CONTENTSIZE_ERROR ? 0 : size;
}

bool decompress_zstandard(std::string_view frame, std::span<char> bytes) {
  return ZSTD_decompress(bytes.data(), bytes.size(), frame.data(), frame.size()) == bytes.size();
}

}  // namespace esim::inline files
