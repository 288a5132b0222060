"""How far `ferryid.diagnose` reaches: simulated trials with known physics left out, diagnosed as a user's would be."""
