#pragma once

namespace esim::inline blender {

// The Python scripts for Blender; see the .py files of this folder.
extern const char* const kCommonScript;  // precedes each of the others
extern const char* const kExportScript;
extern const char* const kBakeScript;
extern const char* const kServeScript;

}  // namespace esim::inline blender
