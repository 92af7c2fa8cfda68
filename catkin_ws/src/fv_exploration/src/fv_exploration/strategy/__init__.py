"""Which view is next: what a strategy is, and those that there are. Free of ROS. See docs/own_strategy.md."""

from fv_exploration.strategy.protocol import HeldViews, Reach, Situation, Strategy
from fv_exploration.strategy.ranking import Candidates, Ranking
from fv_exploration.strategy.registry import STRATEGIES, load_strategy

__all__ = [
    "STRATEGIES",
    "Candidates",
    "HeldViews",
    "Ranking",
    "Reach",
    "Situation",
    "Strategy",
    "load_strategy",
]
