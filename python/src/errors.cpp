#include <cstring>

#include "bindings.h"
#include "esim/core/error.h"

namespace esim::python {
namespace {

namespace nb = nanobind;

void raise(const char* type, const char* message) {
  const nb::object error = nb::module_::import_("esim._errors").attr(type);
  // Paths need not be UTF-8.
  const nb::object text =
      nb::steal(PyUnicode_DecodeUTF8(message, static_cast<Py_ssize_t>(std::strlen(message)), "backslashreplace"));
  PyErr_SetObject(error.ptr(), text.ptr());
}

}  // namespace

void bind_errors(nb::module_&) {
  nb::register_exception_translator([](const std::exception_ptr& exception, void*) {
    try {
      std::rethrow_exception(exception);
    } catch (const OutputError& error) {
      raise("OutputError", error.what());
    } catch (const UserError& error) {
      raise("Error", error.what());
    } catch (const Error& error) {
      raise("InternalError", error.what());
    }
  });
}

}  // namespace esim::python
