#include "esim/formats/aedat4/packing.h"

#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <new>

#include "esim/core/error.h"

namespace esim::inline formats::aedat4 {
namespace {

constexpr std::size_t kFirstBytes = 1 << 16;
constexpr int kZstdLevel = 3;

bool is_lz4(Packing packing) { return packing == Packing::lz4 || packing == Packing::lz4_high; }

/// With a checksum, damage that the codecs would not notice is found.
LZ4F_preferences_t lz4_preferences(std::size_t plain_bytes) {
  LZ4F_preferences_t preferences = LZ4F_INIT_PREFERENCES;
  preferences.frameInfo.contentChecksumFlag = LZ4F_contentChecksumEnabled;
  preferences.frameInfo.contentSize = plain_bytes;
  return preferences;
}

}  // namespace

std::string_view name_of(Packing packing) {
  switch (packing) {
    case Packing::none:
      return "NONE";
    case Packing::lz4:
      return "LZ4";
    case Packing::lz4_high:
      return "LZ4_HIGH";
    case Packing::zstd:
      return "ZSTD";
    case Packing::zstd_high:
      return "ZSTD_HIGH";
  }
  return "";
}

struct Packer::Zstd {
  ~Zstd() { ZSTD_freeCCtx(context); }
  ZSTD_CCtx* context = ZSTD_createCCtx();
};

Packer::Packer(Packing packing) : packing_(packing) {
  if (packing == Packing::none || is_lz4(packing)) return;
  zstd_ = std::make_unique<Zstd>();
  if (zstd_->context == nullptr) throw std::bad_alloc();
  ZSTD_CCtx_setParameter(zstd_->context, ZSTD_c_compressionLevel, kZstdLevel);
  ZSTD_CCtx_setParameter(zstd_->context, ZSTD_c_checksumFlag, 1);
}

Packer::~Packer() = default;

std::string_view Packer::pack(std::string_view plain) {
  if (packing_ == Packing::none) return plain;
  if (is_lz4(packing_)) {
    const LZ4F_preferences_t preferences = lz4_preferences(plain.size());
    packed_.resize(LZ4F_compressFrameBound(plain.size(), &preferences));
    const std::size_t bytes =
        LZ4F_compressFrame(packed_.data(), packed_.size(), plain.data(), plain.size(), &preferences);
    if (LZ4F_isError(bytes)) throw InternalError(std::string("LZ4: ") + LZ4F_getErrorName(bytes));
    return {packed_.data(), bytes};
  }
  packed_.resize(ZSTD_compressBound(plain.size()));
  const std::size_t bytes = ZSTD_compress2(zstd_->context, packed_.data(), packed_.size(), plain.data(), plain.size());
  if (ZSTD_isError(bytes)) throw InternalError(std::string("Zstd: ") + ZSTD_getErrorName(bytes));
  return {packed_.data(), bytes};
}

struct Unpacker::Contexts {
  ~Contexts() {
    LZ4F_freeDecompressionContext(lz4);
    ZSTD_freeDCtx(zstd);
  }

  /// Advances `in` and `out`. Nothing: damaged. False: end of the frame.
  std::optional<bool> step_lz4(std::span<const std::byte>& in, std::span<std::byte>& out) const {
    std::size_t read = in.size(), written = out.size();
    const std::size_t more = LZ4F_decompress(lz4, out.data(), &written, in.data(), &read, nullptr);
    if (LZ4F_isError(more)) return std::nullopt;
    in = in.subspan(read), out = out.subspan(written);
    return more != 0;
  }

  std::optional<bool> step_zstd(std::span<const std::byte>& in, std::span<std::byte>& out) const {
    ZSTD_inBuffer source{in.data(), in.size(), 0};
    ZSTD_outBuffer target{out.data(), out.size(), 0};
    const std::size_t more = ZSTD_decompressStream(zstd, &target, &source);
    if (ZSTD_isError(more)) return std::nullopt;
    in = in.subspan(source.pos), out = out.subspan(target.pos);
    return more != 0;
  }

  void restart() const {
    if (lz4 != nullptr) LZ4F_resetDecompressionContext(lz4);
    if (zstd != nullptr) ZSTD_DCtx_reset(zstd, ZSTD_reset_session_only);
  }

  LZ4F_dctx* lz4 = nullptr;
  ZSTD_DCtx* zstd = nullptr;
};

Unpacker::Unpacker(Packing packing, std::size_t max_bytes)
    : packing_(packing), max_bytes_(max_bytes), contexts_(std::make_unique<Contexts>()) {
  if (packing == Packing::none) return;
  if (is_lz4(packing)) {
    if (LZ4F_isError(LZ4F_createDecompressionContext(&contexts_->lz4, LZ4F_VERSION))) throw std::bad_alloc();
  } else {
    contexts_->zstd = ZSTD_createDCtx();
    if (contexts_->zstd == nullptr) throw std::bad_alloc();
  }
}

Unpacker::~Unpacker() = default;

std::optional<std::span<const std::byte>> Unpacker::unpack(std::span<const std::byte> packed) {
  if (packing_ == Packing::none) {
    plain_.assign(packed.begin(), packed.end());
    return plain_;
  }
  contexts_->restart();
  std::size_t done = 0;
  for (bool more = true; more;) {
    if (done == plain_.size()) {
      if (done >= max_bytes_) return std::nullopt;
      plain_.resize(std::max(kFirstBytes, 2 * done));
    }
    std::span<std::byte> out = std::span(plain_).subspan(done);
    const std::size_t room = out.size(), rest = packed.size();
    const auto step = is_lz4(packing_) ? contexts_->step_lz4(packed, out) : contexts_->step_zstd(packed, out);
    if (!step) return std::nullopt;
    done += room - out.size();
    more = *step;
    const bool stuck = out.size() == room && packed.size() == rest;
    if (more && stuck) return std::nullopt;  // the frame is truncated
  }
  return std::span<const std::byte>(plain_).first(done);
}

}  // namespace esim::inline formats::aedat4
