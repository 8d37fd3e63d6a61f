"""Refuses processors for which the module would end Python with "Illegal instruction"."""


def present(path="/proc/cpuinfo"):
    """The features of the first processor, as Linux names them; empty if unknown."""
    try:
        with open(path) as file:
            flags = next((line for line in file if line.startswith("flags")), "")
    except OSError:
        return set()
    return set(flags.partition(":")[2].split())


def require(needed, present):
    missing = [feature.upper() for feature in needed if feature not in present]
    if present and missing:
        raise ImportError(
            f"this processor does not have {' and '.join(missing)}, which this build of esim needs; build esim from its "
            "sources on this machine"
        )
