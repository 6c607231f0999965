"""Bags of ROS 1 and ROS 2: messages by topic, whole or cut short, and columns of them on one clock."""

from palpate_bags.bag import Bag, Topic
from palpate_bags.from_bag import from_bag
from palpate_bags.reading import Stream, leaves

__all__ = ["Bag", "Stream", "Topic", "from_bag", "leaves"]
