"""A property that is worked out once: by threads side by side too, of different instances, without waiting for each other."""

from __future__ import annotations

from threading import Barrier, Thread

from ferryid.cached import cached_property

WAIT_S = 10.0


class Sum:
    """Two properties, each of which may need that of another instance, at a time at which a second thread is in the other."""

    def __init__(self, barrier: Barrier | None, needs: Sum | None = None) -> None:
        self.barrier, self.needs, self.calls = barrier, needs, 0

    def work(self, name: str) -> int:
        self.calls += 1
        if self.barrier is not None:
            self.barrier.wait(WAIT_S)
        return 1 if self.needs is None else 1 + getattr(self.needs, name)

    @cached_property
    def first(self) -> int:
        """Needs the second of another one."""
        return self.work("second")

    @cached_property
    def second(self) -> int:
        """Needs the first of another one."""
        return self.work("first")


def test_threads_do_not_wait_for_properties_of_other_instances() -> None:
    """Each thread is within one property while it asks for the other: with a lock of the class, neither would end."""
    barrier, found = Barrier(2), list[int]()
    one, other = Sum(barrier, Sum(None)), Sum(barrier, Sum(None))
    asked = lambda: found.append(one.first), lambda: found.append(other.second)
    threads = [Thread(target=ask, daemon=True) for ask in asked]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(WAIT_S)
    assert found == [2, 2]


def test_a_property_is_worked_out_once() -> None:
    one = Sum(None)
    assert [one.first, one.first] == [1, 1]
    assert one.calls == 1


def test_it_is_documented_as_its_method_is() -> None:
    assert Sum.first.__doc__ == "Needs the second of another one."


def test_a_property_that_another_class_overrides_stays_as_it_was_worked_out() -> None:
    class Child(Sum):
        @cached_property
        def first(self) -> int:
            return super().first + 10

        def again(self) -> int:
            return super().first

    one = Child(None)
    assert one.first == 11
    one.again()
    assert one.first == 11
