"""Bags of ROS 1 and ROS 2: messages by topic, whole or cut short, and columns of them on one clock."""

from typing import TYPE_CHECKING

from palpate.lazy import importer

if TYPE_CHECKING:
    from palpate.logs.bags.bag import Bag, Topic
    from palpate.logs.bags.loading import from_bag
    from palpate.logs.bags.reading import Stream, leaves

__all__ = ["Bag", "Stream", "Topic", "from_bag", "leaves"]

__getattr__ = importer(
    __name__, {"bag": ("Bag", "Topic"), "loading": ("from_bag",), "reading": ("Stream", "leaves")}
)
