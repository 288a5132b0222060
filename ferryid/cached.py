"""`functools.cached_property` without the lock that it has before Python 3.12.

That lock belongs to the property of a class and not of one instance: two threads of `ferryid.side_by_side` that work out
properties of different instances wait for each other, and for ever where each needs what the other is at. Without it a property
that two threads ask for at once may be worked out twice, to the same result.

References
----------
https://docs.python.org/3/library/functools.html#functools.cached_property, changed in version 3.12.
"""

from __future__ import annotations

import sys

if sys.version_info >= (3, 12):
    from functools import cached_property
else:
    from collections.abc import Callable
    from typing import Any, Generic, Self, TypeVar, overload

    T = TypeVar("T", covariant=True)

    class cached_property(Generic[T]):
        """A method that is called once for an instance and then is an attribute of it."""

        def __init__(self, method: Callable[[Any], T]) -> None:
            self.method = method
            self.__doc__ = method.__doc__

        def __set_name__(self, owner: type, name: str) -> None:
            self.name = name

        @overload
        def __get__(self, instance: None, owner: type) -> Self: ...
        @overload
        def __get__(self, instance: object, owner: type) -> T: ...
        def __get__(self, instance: object | None, owner: type) -> Self | T:
            if instance is None:
                return self
            # An attribute of the instance comes before this, which defines no `__set__`: only `super()` asks again.
            if self.name not in instance.__dict__:
                instance.__dict__[self.name] = self.method(instance)
            found: T = instance.__dict__[self.name]
            return found


__all__ = ["cached_property"]
