"""Old names of attributes, keys and arguments, which stay valid with a DeprecationWarning."""

import functools
import warnings


def present_name(name, renamed, stacklevel=2):
    """The present name for an old one; any other name as it is.

    Parameters
    ----------
    name : object
    renamed : dict of str to str
        Present names by old name.
    stacklevel : int
        Of the warning; 1 is the caller.
    """
    if not isinstance(name, str) or name not in renamed:
        return name
    warnings.warn(f"{name} is now {renamed[name]}", DeprecationWarning, stacklevel=stacklevel + 1)
    return renamed[name]


class OldAttributes:
    """A base class: attributes in `_renamed` can also be read by their old names."""

    __slots__ = ()
    _renamed = {}

    def __getattr__(self, name):
        if name not in self._renamed:
            self._miss(name)
        return getattr(self, present_name(name, self._renamed))

    def _miss(self, name):
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")


class OldKeys(dict):
    """A dict in which values can also be looked up by the old names of their keys."""

    RENAMED = {
        "displacement_rms_px": "optical_flow_rms_px",
        "flow_t": "motion_field_t",
        "keyframes": "poses",
        "resampling_floor": "resampling_error",
        "unseen_share": "unseen_fraction",
    }

    def __missing__(self, key):
        if not isinstance(key, str) or self.RENAMED.get(key) not in self:
            raise KeyError(key)
        return self[present_name(key, self.RENAMED)]


def old_arguments(**renamed):
    """A decorator: keyword arguments can also be given by their old names."""

    def decorate(function):
        @functools.wraps(function)
        def with_old_arguments(*arguments, **options):
            for old in renamed.keys() & options.keys():
                if renamed[old] in options:
                    raise TypeError(f"{old} must not be given together with {renamed[old]}, its new name; remove {old}")
                options[present_name(old, renamed)] = options.pop(old)
            return function(*arguments, **options)

        return with_old_arguments

    return decorate
