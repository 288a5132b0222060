"""One file a study: ``PLACE`` says where it stands on the page, ``study(lab)`` carries it out."""
