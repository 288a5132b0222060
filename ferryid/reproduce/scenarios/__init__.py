"""The trials that the studies fly; `ferryid simulate` flies them too, by their path."""
