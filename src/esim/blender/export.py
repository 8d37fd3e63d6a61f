# Writes a .blend as GLB. Arguments: the .blend, the GLB.
import sys

source, target = sys.argv[sys.argv.index("--") + 1:][:2]
esim_progress(0.1, "opening the scene")
esim_open(source)
esim_progress(0.5, "exporting")
esim_export(target)
