#pragma once

namespace esim {

// The Python that Blender runs; see the .py files of this folder.
extern const char* const kCommonScript;  // goes before each of the others
extern const char* const kExportScript;
extern const char* const kBakeScript;
extern const char* const kServeScript;

}  // namespace esim
