#pragma once

namespace esim::test {

/// Whether a sanitizer makes the tests 5 to 20 times slower. Long computations whose code other tests run, too, are
/// then left out.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace esim::test
