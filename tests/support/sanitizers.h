#pragma once

namespace esim::test {

/// Whether a sanitizer makes the tests 5 to 20 times slower. Long computations whose code other tests run, too, are
/// then left out.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#elif defined(__has_feature)  // of clang
inline constexpr bool kSanitized = __has_feature(address_sanitizer) || __has_feature(thread_sanitizer);
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace esim::test
