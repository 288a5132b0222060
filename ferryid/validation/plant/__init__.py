"""The plant: a six-degree-of-freedom vessel under control in wind and sea, which shares no formula with the rest of ferryid."""
