"""Effects concealed in real recordings: the record is changed so that physics with the effect explains it."""
