#include "bindings.h"

namespace esim::python {

void bind_representations(nanobind::module_&) {}

}  // namespace esim::python
