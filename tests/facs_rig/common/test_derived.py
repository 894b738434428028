"""What follows from an object is worked out once and kept with it."""

import copy
import gc
import weakref

from facs_rig.common.derived import derived, forget


class Owner:
    def __init__(self, value):
        self.value = value


def test_once_for_each_owner_and_gone_with_it():
    asked = []

    @derived
    def twice(owner):
        """Two of it."""
        asked.append(owner.value)
        return 2 * owner.value

    one, two = Owner(3), Owner(5)
    assert [twice(one), twice(two), twice(one)] == [6, 10, 6]
    assert asked == [3, 5]
    assert twice.__doc__ == "Two of it."
    gone = weakref.ref(one)
    del one
    gc.collect()
    assert gone() is None


def test_a_copy_that_becomes_something_else_forgets():
    @derived
    def twice(owner):
        return 2 * owner.value

    @derived
    def thrice(owner):
        return 3 * owner.value

    one = Owner(3)
    assert (twice(one), thrice(one)) == (6, 9)
    other = copy.copy(one)
    forget(other)
    other.value = 4
    assert (twice(other), thrice(other)) == (8, 12)
    assert (twice(one), thrice(one)) == (6, 9)
