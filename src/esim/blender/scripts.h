#pragma once

namespace esim {

// The Python that Blender runs; see the .py files of this folder.
extern const char* const kLegacyScript;
extern const char* const kExportScript;
extern const char* const kBakeScript;

}  // namespace esim
