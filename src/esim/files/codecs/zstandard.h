#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace esim::inline files {

/// Bytes as a Zstandard frame with a checksum. Higher levels are slower and smaller; negative ones are the fastest.
void compress_zstandard(std::string_view bytes, int level, std::string& frame);

/// The number of bytes that a frame says it contains; 0 if it does not.
std::uint64_t zstandard_content_size(std::string_view frame);

/// Decompresses a frame of exactly so many bytes. False if it is damaged or contains another number of bytes.
bool decompress_zstandard(std::string_view frame, std::span<char> bytes);

}  // namespace esim::inline files
