"""An address of the tab's own."""

from fastapi import APIRouter

router = APIRouter()


@router.get("/api/steps/marker/words")
async def words() -> dict[str, str]:
    return {"words": "a marker"}
