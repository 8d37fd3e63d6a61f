// Debian's static library of OpenCV's core refers to LAPACK, which is 70 MB large, and to GLX, which needs X11. esim
// uses neither. These functions replace those that call them: OpenCV then uses its own decompositions and products.
#include <cstddef>

namespace {
constexpr int kNotImplemented = 1;  // CV_HAL_ERROR_NOT_IMPLEMENTED
}

#define WITHOUT_LAPACK(Number, bits)                                                                                   \
  int lapack_LU##bits(Number*, std::size_t, int, Number*, std::size_t, int, int*) { return kNotImplemented; }          \
  int lapack_Cholesky##bits(Number*, std::size_t, int, Number*, std::size_t, int, bool*) { return kNotImplemented; }   \
  int lapack_SVD##bits(Number*, std::size_t, Number*, Number*, std::size_t, Number*, std::size_t, int, int, int) {     \
    return kNotImplemented;                                                                                            \
  }                                                                                                                    \
  int lapack_QR##bits(Number*, std::size_t, int, int, int, Number*, std::size_t, Number*, int*) {                      \
    return kNotImplemented;                                                                                            \
  }                                                                                                                    \
  int lapack_gemm##bits(const Number*, std::size_t, const Number*, std::size_t, Number, const Number*, std::size_t,    \
                        Number, Number*, std::size_t, int, int, int, int) {                                            \
    return kNotImplemented;                                                                                            \
  }                                                                                                                    \
  int lapack_gemm##bits##c(const Number*, std::size_t, const Number*, std::size_t, Number, const Number*, std::size_t, \
                           Number, Number*, std::size_t, int, int, int, int) {                                         \
    return kNotImplemented;                                                                                            \
  }
WITHOUT_LAPACK(float, 32f)
WITHOUT_LAPACK(double, 64f)

extern "C" void* glXGetProcAddressARB(const unsigned char*) { return nullptr; }
