#include <cstring>

#include "bindings.h"
#include "remedies.h"

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

std::string with_remedy(const std::string& message, Remedy remedy) {
  switch (remedy) {
    case Remedy::replace_output:
      return message + ", or pass force=True to replace it";
    case Remedy::choose_camera:
      return message + " with camera=";
    case Remedy::extract_camera:
      return message + ", with esim.convert(..., camera=...)";
    case Remedy::times_from_zero:
      return message + ", or let times begin at 0, as esim.convert(..., from_zero=True) does";
    case Remedy::nanoseconds:
      return message + "; time_unit=\"ns\" keeps them";
    case Remedy::sensor_size:
      return message + " with width= and height=";
    case Remedy::shorter_video:
      return message + " (start_s=, duration_s=, slow_motion=)";
    case Remedy::shift_times:   // not in Python
    case Remedy::keep_samples:  // the message says it
    case Remedy::none:
      break;
  }
  return message;
}

void bind_errors(nb::module_&) {
  nb::register_exception_translator([](const std::exception_ptr& exception, void*) {
    try {
      std::rethrow_exception(exception);
    } catch (const OutputError& error) {
      raise("OutputError", error.what());
    } catch (const RemediableError& error) {
      raise("Error", with_remedy(error.what(), error.remedy()).c_str());
    } catch (const UserError& error) {
      raise("Error", error.what());
    } catch (const Error& error) {
      raise("InternalError", error.what());
    }
  });
}

}  // namespace esim::python
