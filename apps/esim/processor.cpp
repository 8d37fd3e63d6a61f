#include <unistd.h>

// Before main() and before the constructors of other files, which may need AVX2: without this, the program would end
// with "Illegal instruction". Only the C library is used, since other headers could contain code that needs AVX2.
#ifdef ESIM_USES_AVX2
namespace esim::app {
namespace {

[[gnu::constructor(101)]] void require_avx2() {
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2")) return;
  constexpr char kMessage[] =
      "esim: this processor does not have AVX2 and FMA, which this build needs; build esim from its sources on this "
      "machine\n";
  [[maybe_unused]] const auto written = write(STDERR_FILENO, kMessage, sizeof kMessage - 1);
  _exit(2);
}

}  // namespace
}  // namespace esim::app
#endif
