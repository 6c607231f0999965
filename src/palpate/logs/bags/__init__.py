"""Bags of ROS 1 and ROS 2: messages by topic, whole or cut short."""

from __future__ import annotations

from palpate.logs.bags.bag import Bag, Topic
from palpate.logs.bags.reading import Stream

__all__ = ["Bag", "Stream", "Topic"]
