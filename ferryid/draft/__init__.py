"""A vessel profile drafted from a log: what each topic is, with the evidence, and what only a person knows."""

from ferryid.draft.create import new_profile
from ferryid.draft.draft import Draft, draft_profile
from ferryid.draft.write import Answers, Question, StatedWindow, draft_text, questions

__all__ = ["Answers", "Draft", "Question", "StatedWindow", "draft_profile", "draft_text", "new_profile", "questions"]
